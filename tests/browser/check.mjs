// Counts what holds, and prints what does not. `--times` runs the parts that are held to times, beside which nothing else may run;
// `--functions` the others; other words those parts whose sentence has them.
const asked = process.argv[2] ?? "";

export class Checks {
  passed = 0;
  failed = 0;

  that(sentence, holds, ...seen) {
    if (holds) {
      this.passed += 1;
      return;
    }
    this.failed += 1;
    console.log(`does not hold: ${sentence}`, ...seen);
  }

  /** Runs a part if it is asked for; what it throws is one that does not hold. */
  async part(sentence, run, { timed = false } = {}) {
    const isAsked = asked.startsWith("--") ? asked === (timed ? "--times" : "--functions") : sentence.includes(asked);
    if (!isAsked) return;
    const started = performance.now();
    try {
      await run();
    } catch (error) {
      this.that(sentence, false, error.stack ?? error);
    }
    console.log(`${sentence}: ${((performance.now() - started) / 1000).toFixed(0)} s`);
  }

  /** Fails too where nothing was asked for that there is. */
  end() {
    console.log(`${this.passed} passed, ${this.failed} failed`);
    process.exitCode = this.failed === 0 && this.passed > 0 ? 0 : 1;
  }
}
