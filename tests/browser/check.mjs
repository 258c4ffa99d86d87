// Counts what holds, and prints what does not.
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

  /** Runs a part, where no words of other parts are asked for; what it throws is one that does not hold. */
  async part(sentence, run) {
    if (process.argv[2] && !sentence.includes(process.argv[2])) return;
    try {
      await run();
    } catch (error) {
      this.that(sentence, false, error.stack ?? error);
    }
  }

  end() {
    console.log(`${this.passed} passed, ${this.failed} failed`);
    process.exitCode = this.failed === 0 ? 0 : 1;
  }
}
