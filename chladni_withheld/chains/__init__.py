"""Chains, trees and drives with hidden effects: their own equations, laws and integrator."""
