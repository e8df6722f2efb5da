"""The source configuration of an import: schema, loading and checks."""
