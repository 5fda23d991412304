// The motion of a program: keys between which everything moves along straight lines in time, and the clock.

export class Motion {
  constructor(data, arrays) {
    this.data = data;
    this.times = arrays.column("key.time");
    this.tips = arrays.rows("key.tip");
    this.axes = arrays.rows("key.axis");
    this.joints = "key.joints" in arrays.directory ? arrays.rows("key.joints") : new Float32Array();
    this.areThere = false; // are the joints where the part is now, not where it was planned?
    this.kinds = arrays.whole("key.kind");
    this.segments = arrays.whole("key.segment");
    this.causes = arrays.whole("key.cause");
    this.nearest = arrays.whole("key.nearest");
    this.values = Object.fromEntries(data.scales.filter(({ array }) => array !== "key.cause").map(({ array }) => [array, arrays.column(array)]));
    this.count = this.times.length;
    this.duration = this.times[this.count - 1];
  }

  /** The key at or before a time. */
  before(time) {
    let low = 0, high = Math.max(this.count - 2, 0);
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.times[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  /** Where the machine is at a time: {key, tip, axis, joints}. */
  at(time) {
    const key = this.before(time), next = Math.min(key + 1, this.count - 1), lasts = this.times[next] - this.times[key];
    const share = lasts > 0 ? Math.min(Math.max((time - this.times[key]) / lasts, 0), 1) : 0;
    const between = (rows, width) => Array.from({ length: width }, (_, d) => rows[width * key + d] + share * (rows[width * next + d] - rows[width * key + d]));
    const axis = between(this.axes, 3), norm = Math.hypot(...axis);
    return { key, tip: between(this.tips, 3), axis: axis.map((v) => v / norm), joints: between(this.joints, this.joints.length / this.count) };
  }
}

/** Time that is set, or runs; `listeners` are told of it, and `onRun` whether it runs. */
export class Clock {
  constructor(duration) {
    this.duration = duration;
    this.now = 0;
    this.speed = 4;
    this.isRunning = false;
    this.listeners = [];
    this.onRun = () => {};
    this.onFrame = () => {};
  }

  set(time) {
    this.now = Math.min(Math.max(time, 0), this.duration);
    for (const listener of this.listeners) listener(this.now);
  }

  /** Stop, and go to a time. */
  go(time) { this.stop(); this.set(time); }

  stop() {
    if (!this.isRunning) return;
    this.isRunning = false;
    this.onRun(false);
    this.set(this.now);
  }

  run() {
    if (this.now >= this.duration) this.now = 0;
    this.isRunning = true;
    this.onRun(true);
    let last = 0;
    const frame = (stamp) => {
      if (!this.isRunning) return;
      const passed = last ? (stamp - last) / 1000 : 0, begun = performance.now();
      last = stamp;
      this.set(this.now + passed * this.speed);
      this.onFrame(1000 * passed, performance.now() - begun);
      if (this.now >= this.duration) this.stop();
      else requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  toggle() { if (this.isRunning) this.stop(); else this.run(); }
}
