function dP = reduced (P, u, x, v, n, c)
  % Section 3: rates of the pressures of models M1 to M10 (rows) in chambers A and B (columns), Pa/s, each by its
  % own line. The heat of M7 to M10 is printed with T - T_amb, by which hot air would heat up.
  x = [x, -x];
  A = pi * c.bore ^ 2 / 4;
  g = c.gamma;
  R = c.R;
  V = c.dead_volume_m3 + A * (c.stroke / 2 + x);
  dV = A * [v, -v];
  A_q = pi * c.bore ^ 2 / 2 + pi * c.bore * (c.stroke / 2 + x);
  A_q0 = pi * c.bore ^ 2 / 2 + pi * c.bore * c.stroke / 2;
  T = c.T_0 * (P / c.P_0) .^ ((n - 1) / n);                                  % (6)
  T(1:4,:) = c.T_0;                                                          % M1 to M4: constant
  [m_in, m_out] = valve_flows ([u, -u], P, T, c);
  net = m_in - m_out;
  k = c.k_0_W_per_K;
  lambda = k / A_q0;
  mix = m_in * c.T_in_K - m_out .* T;
  cold = c.T_amb_K - T;
  root = sqrt (P(10,:) .* T(10,:) / (c.P_0 * c.T_0));
  W = [
    -P(1,:) .* dV + R * T(1,:) .* net(1,:)
    -n * P(2,:) .* dV + n * R * T(2,:) .* net(2,:)
    -g * P(3,:) .* dV + g * R * T(3,:) .* net(3,:)
    -1.2 * P(4,:) .* dV + 1.4 * R * T(4,:) .* m_in(4,:) - R * T(4,:) .* m_out(4,:)
    -n * P(5,:) .* dV + n * R * T(5,:) .* net(5,:)
    -n * P(6,:) .* dV + n * R * mix(6,:)
    -g * P(7,:) .* dV + g * R * T(7,:) .* net(7,:) + (g - 1) * k * cold(7,:)
    -g * P(8,:) .* dV + g * R * mix(8,:) + (g - 1) * k * cold(8,:)
    -g * P(9,:) .* dV + g * R * mix(9,:) + (g - 1) * lambda * A_q .* cold(9,:)
    -g * P(10,:) .* dV + g * R * mix(10,:) + (g - 1) * lambda * A_q .* root .* cold(10,:)
  ];
  dP = W ./ V;
end
