% The paper's equations once more: full order and M1 to M10 on one experiment, Dormand-Prince with a fixed step.
%
%   octave-cli crosscheck.m NUMBERS OUTPUT
%
% NUMBERS is a text of "name value" lines in the units that the names say. OUTPUT gets doubles, one record per step:
% x, v, P_A, T_A, P_B, T_B, then P of M1 to M10 in chamber A and in B with exact signals (reduced and full-order
% models are one system), then both again with the published one (1 ms samples: replays_read is
% 0 for interpolated, 1 for held, 2 for held but at the end of a step the next).
1;

paths = argv ();
file = fopen (paths{1}, "r");
numbers = textscan (file, "%s %f");
fclose (file);
c = cell2struct (num2cell (numbers{2}), numbers{1}, 1);
c.bore = c.bore_mm / 1000;
c.stroke = c.stroke_mm / 1000;
c.x_reverse = c.reverse_at * c.stroke / 2;
c.P_0 = c.P_0_per_P_s * c.P_s_Pa;
c.T_0 = c.T_amb_K;
c.R = c.R_J_per_kgK;

a = [0, 0, 0, 0, 0, 0
     1/5, 0, 0, 0, 0, 0
     3/40, 9/40, 0, 0, 0, 0
     44/45, -56/15, 32/9, 0, 0, 0
     19372/6561, -25360/2187, 64448/6561, -212/729, 0, 0
     9017/3168, -355/33, 46732/5247, 49/176, -5103/18656, 0];
b = [35/384; 0; 500/1113; 125/192; -2187/6784; 11/84];
node = [0; 1/5; 3/10; 4/5; 8/9; 1];

h = c.step_s;
steps = round (c.duration_s / h);
every = round (c.sample_time_s / h);
draws = random_number (c.seed, floor (steps / every) + 1);
if (c.closed_loop)
  levels = c.amplitude * draws;
else
  levels = c.amplitude * sign (draws);
end
limit = @(u) min (max (u, -c.u_max_V), c.u_max_V);

% Full order and, with exact signals, reduced models.
y = [0; 0; c.P_0; c.T_0; c.P_0; c.T_0; c.P_0 * ones(20, 1)];
states = zeros (26, steps + 1);
states(:,1) = y;
command = zeros (1, steps + 1);
K = zeros (26, 6);
sign_kept = 1;
for k = 1:steps
  reference = sign_kept * levels(floor ((k - 1) / every) + 1);
  if (! c.closed_loop && abs (y(1)) >= c.x_reverse && reference * y(1) > 0)
    reference = -reference;
    sign_kept = -sign_kept;
  end
  command(k) = command_voltage (reference, y(1), c);
  for i = 1:6
    z = y + h * (K * a(i,:)');
    u = limit (command_voltage (reference, z(1), c));
    K(:,i) = [full_order(z(1:6), u, c)
              reduced(reshape (z(7:26), 10, 2), u, z(1), z(2), c.n, c)(:)];
  end
  y = y + h * (K * b);
  if (abs (y(1)) >= c.stroke / 2)
    error ("crosscheck: the piston meets a stop at %g s", k * h);
  end
  states(:,k+1) = y;
end
command(steps + 1) = command_voltage (sign_kept * levels(floor (steps / every) + 1), y(1), c);

% Reduced models on the recorded signals.
signals = [command; states(1:2,:)];
P = c.P_0 * ones (20, 1);
published = zeros (20, steps + 1);
published(:,1) = P;
K = zeros (20, 6);
for k = 1:steps
  for i = 1:6
    if (c.replays_read == 0)
      share = node(i);
    else
      share = (c.replays_read == 2 && node(i) == 1);
    end
    signal = signals(:,k) + share * (signals(:,k+1) - signals(:,k));
    p = P + h * (K * a(i,:)');
    K(:,i) = reduced (reshape (p, 10, 2), limit (signal(1)), signal(2), signal(3), c.n, c)(:);
  end
  P = P + h * (K * b);
  published(:,k+1) = P;
end

file = fopen (paths{2}, "w");
fwrite (file, [states; published], "double");
fclose (file);
