"""Import a vendor's robot file, with or without a source configuration, into a robot package."""
