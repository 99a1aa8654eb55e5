function m = mass_flow (A_t, P_u, P_d, T_u, c)
  % Eq. (1): mass flow through a restriction, kg/s, from P_u to P_d, both absolute, Pa.
  r = P_d ./ P_u;
  g = c.gamma;
  root = sqrt (2 * g ./ ((g - 1) * c.R * T_u) .* max (r .^ (2 / g) - r .^ ((g + 1) / g), 0));
  m = A_t .* P_u .* root;
  sonic = r <= c.critical_ratio;
  choked = c.sonic_coefficient * P_u .* A_t ./ sqrt (T_u);
  m(sonic) = choked(sonic);
end
