"""What a diagnosis says: the types of the answer and of its arrays, which every stage may know."""
