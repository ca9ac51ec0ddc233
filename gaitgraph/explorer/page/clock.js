// One time for all pictures: the phase of the period, from 0 to 1, which plays, is scrubbed, or follows the pointer.

export function clockOf(onPhase, onPlaying) {
  let phase = 0;
  let playing = false;
  let held = false; // the pointer sets the time for a while
  let running = false;
  let seconds = 1; // that one period takes on the screen
  let last = 0;

  function frame(now) {
    if (!running) return;
    phase = (phase + Math.min(0.1, Math.max(0, now - last) / 1000) / seconds) % 1;
    last = now;
    onPhase(phase, "clock");
    requestAnimationFrame(frame);
  }

  function update() {
    const next = playing && !held;
    if (next === running) return;
    running = next;
    if (!running) return;
    last = performance.now();
    requestAnimationFrame(frame);
  }

  function set(value, source) {
    phase = Math.min(1, Math.max(0, value));
    onPhase(phase, source);
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
    set,
    /** Show the time under the pointer; what plays waits until it is released. */
    hold(value, source) {
      held = true;
      update();
      set(value, source);
    },
    release() {
      held = false;
      update();
    },
    play(wanted) {
      if (wanted === playing) return;
      playing = wanted;
      onPlaying(playing);
      update();
    },
  };
}

/** Whether the reader asked for less motion. */
export function prefersStillness() {
  return matchMedia("(prefers-reduced-motion: reduce)").matches;
}
