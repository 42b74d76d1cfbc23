"""What generator and runtime both know of scenes: tables, units, layout, signatures."""
