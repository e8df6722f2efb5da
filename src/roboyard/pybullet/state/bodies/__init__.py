"""The bodies of one client: what is known of each beside the World's own state."""
