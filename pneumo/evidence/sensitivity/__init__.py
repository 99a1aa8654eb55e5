"""Results under other assumptions, other physics and known mistakes."""
