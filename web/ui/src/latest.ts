// Newest wins: while one call is under way only the newest of the values that came in meanwhile is kept.
export class LatestCall<T> {
  private busy = false;
  private waiting: { value: T } | null = null;

  constructor(private readonly call: (value: T) => Promise<unknown>, private readonly failed: (error: unknown) => void) {}

  get idle(): boolean {
    return !this.busy;
  }

  /// `merge` combines the waiting value with the new one; without it the new one replaces it.
  async send(value: T, merge?: (waiting: T, added: T) => T): Promise<void> {
    this.waiting = { value: this.waiting && merge ? merge(this.waiting.value, value) : value };
    if (this.busy) return;
    this.busy = true;
    while (this.waiting) {
      const next: T = this.waiting.value;
      this.waiting = null;
      try {
        await this.call(next);
      } catch (error) {
        this.failed(error);
      }
    }
    this.busy = false;
  }
}
