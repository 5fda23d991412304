"""Proofs in continuous time: components, chords, motions, tip and platform."""
