"""The importer: a vendor's robot and a source config in, a complete robot package out."""
