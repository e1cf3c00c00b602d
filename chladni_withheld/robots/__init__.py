"""Withheld robots: arms and legs that Pinocchio moves, in a position loop, with what their descriptions lack.

Written from what the words mean alone; Pinocchio and the descriptions of example-robot-data are asked for here only.
"""
