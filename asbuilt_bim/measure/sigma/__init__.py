"""How sure an area and the rig's scale are."""
