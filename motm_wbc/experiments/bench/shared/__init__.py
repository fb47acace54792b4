"""What peers' workers read as well: one module that needs numpy and nothing else of ours."""
