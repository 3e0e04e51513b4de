"""What tests share: tunnels, surveys, scenes and files that are made for them."""
