"""Joint drives: PID actuators, and motors as velocity constraints."""
