"""Draws pictures of building sites with exact masks, instances and depth, to train on."""
