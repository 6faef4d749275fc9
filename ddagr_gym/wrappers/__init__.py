"""Adapters between the environments and other libraries."""
