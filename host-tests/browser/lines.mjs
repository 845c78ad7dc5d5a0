// Plain geometry for the tests, which shares nothing with the page.

const gap = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);

/** Distance of a point from a polyline. */
export function distance(p, line) {
  let least = gap(p, line[0]);
  for (let i = 1; i < line.length; i++) {
    const [a, b] = [line[i - 1], line[i]], square = gap(a, b) ** 2;
    const t = square ? Math.min(1, Math.max(0, ((p[0] - a[0]) * (b[0] - a[0]) + (p[1] - a[1]) * (b[1] - a[1])) / square)) : 0;
    least = Math.min(least, gap(p, [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]));
  }
  return least;
}

/** Length of a polyline. */
export const length = line => line.slice(1).reduce((sum, p, i) => sum + gap(line[i], p), 0);
