"""Import whole collections of robots, each in a process of its own, so that a run can stop at any time."""
