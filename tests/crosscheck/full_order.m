function dy = full_order (y, u, c)
  % Eqs (3) to (5), (7) and (8). y = [x; v; P_A; T_A; P_B; T_B] in SI units; u is the limited command, V.
  x = [y(1), -y(1)];
  P = [y(3), y(5)];
  T = [y(4), y(6)];
  A = pi * c.bore ^ 2 / 4;
  g = c.gamma;
  V = c.dead_volume_m3 + A * (c.stroke / 2 + x);
  dV = A * [y(2), -y(2)];
  [m_in, m_out] = valve_flows ([u, -u], P, T, c);
  A_q = pi * c.bore ^ 2 / 2 + pi * c.bore * (c.stroke / 2 + x);
  A_q0 = pi * c.bore ^ 2 / 2 + pi * c.bore * c.stroke / 2;
  lambda = c.k_0_W_per_K / A_q0 * sqrt (P .* T / (c.P_0 * c.T_0));            % (8), with (12)
  Q = lambda .* A_q .* (c.T_amb_K - T);                                      % (7): heat to the air
  dP = -g * P ./ V .* dV + g * c.R ./ V .* (m_in * c.T_in_K - m_out .* T) ...
       + (g - 1) ./ V .* Q;                                                  % (4); printed: -Q
  dT = T ./ V .* dV * (1 - g) - m_out * c.R .* T .^ 2 ./ (V .* P) * (g - 1) ...
       + m_in * c.R .* T ./ (V .* P) .* (g * c.T_in_K - T) ...
       + (g - 1) * T ./ (P .* V) .* Q;                                       % (5); printed: -Q and without T
  force = (P(1) - P(2)) * A - c.friction_Ns_per_m * y(2);
  dy = [y(2); force / c.mass_kg; dP(1); dT(1); dP(2); dT(2)];                % (3)
end
