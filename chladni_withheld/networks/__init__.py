"""Withheld machines of other structure and physics: trees and loops of bodies, driven between their samples.

Written from what the words of effects mean alone, with an integrator, laws, recorders and signals of its own.
"""
