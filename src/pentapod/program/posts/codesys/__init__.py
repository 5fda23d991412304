"""Kinematics as Structured Text, for controllers that are programmed by IEC 61131-3: CODESYS, TwinCAT."""
