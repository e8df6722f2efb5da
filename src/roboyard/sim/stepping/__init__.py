"""One time step: contacts, constraints, surface effects and external forces."""
