function [m_in, m_out] = valve_flows (u, P, T, c)
  % Eq. (2): flows of chambers whose command, counted positive where it opens them to the supply, is u. The areas
  % for u < 0 need |u| (printed: u). Air flows from the higher pressure to the lower one, also into the supply.
  A_t = c.k_x_k_u_m2_per_V * abs (u) .* ones (size (P));
  port = c.P_atm_Pa + (c.P_s_Pa - c.P_atm_Pa) * (u >= 0) .* ones (size (P));
  inward = port >= P;
  T_u = T;
  T_u(inward) = c.T_in_K;
  m = mass_flow (A_t, max (port, P), min (port, P), T_u, c);
  m_in = m .* inward;
  m_out = m .* ! inward;
end
