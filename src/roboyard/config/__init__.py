"""YAML files: values with line numbers, edits that keep comments, validation errors as text."""
