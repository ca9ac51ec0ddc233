// One time for all pictures: the phase of the period, from 0 to 1, which plays, is scrubbed, or follows the pointer.

export function clockOf(onPhase, onPlaying) {
  let phase = 0;
  let playing = false;
  let seconds = 1; // that one period takes on the screen
  let last = 0;

  function frame(now) {
    if (!playing) return;
    phase = (phase + Math.min(0.1, (now - last) / 1000) / seconds) % 1;
    last = now;
    onPhase(phase, "clock");
    requestAnimationFrame(frame);
  }

  return {
    get phase() {
      return phase;
    },
    get playing() {
      return playing;
    },
    setSeconds(value) {
      seconds = Math.max(0.05, value);
    },
    set(value, source) {
      phase = Math.min(1, Math.max(0, value));
      onPhase(phase, source);
    },
    play(wanted) {
      if (wanted === playing) return;
      playing = wanted;
      onPlaying(playing);
      if (!playing) return;
      last = performance.now();
      requestAnimationFrame(frame);
    },
  };
}

/** Whether the reader asked for less motion. */
export function prefersStillness() {
  return matchMedia("(prefers-reduced-motion: reduce)").matches;
}
