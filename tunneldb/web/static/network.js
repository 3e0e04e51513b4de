/** Whether the page shows the database, or what the device holds of it. */

const PROBE = 5000;

/** State of the network, as the service worker reports it. */
export class Network {
  /**
   * @param {string|null} held - time of the copy of the page, ISO; null if the server sent it.
   * @param {Object} on - away(), back().
   */
  constructor(held, on) {
    this.on = on;
    this.away = false;
    this.since = null;
    const worker = navigator.serviceWorker;
    worker?.addEventListener('message', ({ data }) => this.leave(data.held));
    window.addEventListener('offline', () => worker?.controller && this.leave(null));
    window.addEventListener('online', () => this.probe());
    if (!held && (navigator.onLine || !worker?.controller)) return;
    this.away = true;
    this.since = held;
    if (navigator.onLine) this.probe();
    else this.later();
  }

  /** Note that the server cannot be reached, and the time of what is shown instead. */
  leave(held) {
    const older = held && (!this.since || held < this.since);
    if (this.away && !older) return;
    if (older) this.since = held;
    this.away = true;
    this.on.away();
    this.later();
  }

  later() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.probe(), PROBE);
  }

  /** Ask the server whether it is there. */
  async probe() {
    if (!this.away) return;
    try {
      const response = await fetch('/healthz', { cache: 'no-store', signal: AbortSignal.timeout(PROBE) });
      if (!response.ok) throw new Error('no database');
    } catch {
      this.later();
      return;
    }
    if (!this.away) return;
    clearTimeout(this.timer);
    this.away = false;
    this.since = null;
    navigator.serviceWorker?.controller?.postMessage('online');
    this.on.back();
  }
}
