function u = command_voltage (reference, x, c)
  % Figs 4 and 5: command before its limiter, V.
  if (c.closed_loop)
    u = c.k_p_V_per_m * (reference - x);
  elseif (x >= c.x_reverse)
    u = -abs (reference);
  elseif (x <= -c.x_reverse)
    u = abs (reference);
  else
    u = reference;
  end
end
