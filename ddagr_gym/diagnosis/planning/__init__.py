"""Before a drive: what could be seen in it, and which drive would settle what is open."""
