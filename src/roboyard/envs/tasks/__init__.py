"""The tasks that come with Roboyard; each function returns a `Task` for any robot that can do it."""
