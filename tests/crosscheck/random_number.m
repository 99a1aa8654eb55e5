function values = random_number (seed, count)
  % Standard normal deviates of MATLAB's v4 generator (Simulink's Random Number block): a multiplicative
  % congruential generator, polar method, second deviate discarded. Doubles hold 16807 (2^31 - 2) exactly.
  high = floor (seed / 65536);
  bit = bitand (seed, 32768);
  state = mod ((seed - high * 65536 + bit) * 65536 + bit + high, 2 ^ 32);
  if (state == 0)
    state = 1144108930;
  end
  state = min (state, 2147483646);
  values = zeros (count, 1);
  for i = 1:count
    w = 2;
    while (w > 1)
      state = mod (16807 * state, 2147483647);
      a = 2 * state * 4.656612875245797e-10 - 1;
      state = mod (16807 * state, 2147483647);
      b = 2 * state * 4.656612875245797e-10 - 1;
      w = a * a + b * b;
    end
    values(i) = sqrt (-2 * log (w) / w) * a;
  end
end
