"""Inverse problems that a user would recognise, solved by gradients through the models."""
