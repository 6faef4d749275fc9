"""Learned policies: what they see, how they act, and files of plain numbers from which they run without torch.

``view`` turns the environment's observation into the policy's inputs and the policy's outputs into bank speeds, in
training and in evaluation alike. ``archive`` reads and writes policies, ``controller`` drives with them.
"""
