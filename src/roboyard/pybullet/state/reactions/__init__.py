"""Forces and torques in joints, as sensors read them."""
