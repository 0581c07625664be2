import { useSignalEffect } from '@preact/signals';
import { useEffect, useRef } from 'preact/hooks';
import type { Trace } from '../model/series';
import { dark } from '../settings';
import type { Chart } from './chart';
import { dashOf, type ChartSpec, type Mark } from './chart-spec';

export interface Picture { traces: readonly Trace[]; from: number; to: number; marks: readonly Mark[] }

/** A chart that is drawn anew whenever a signal that `picture` reads has changed. */
export function ChartView({ spec, picture, label, keep }:
    { spec: ChartSpec; picture: () => Picture; label: string; keep?: (chart: Chart | null) => void }) {
  const place = useRef<HTMLDivElement>(null);
  const chart = useRef<Chart | null>(null);
  const latest = useRef(picture);
  latest.current = picture;
  const shape = JSON.stringify([spec.lines, spec.height, spec.clock]);
  const draw = () => {
    const { traces, from, to, marks } = latest.current();
    chart.current?.show(traces, from, to, marks);
  };
  useEffect(() => {
    let left = false;
    const resized = new ResizeObserver(draw);
    void import('./chart').then(({ Chart: Made }) => {
      if (left) return;
      chart.current = new Made(place.current!, { ...spec, ...(spec.pick ? { pick: (at: number) => pick.current?.(at) } : {}) });
      keep?.(chart.current);
      draw();
      resized.observe(place.current!);
    });
    return () => { left = true; resized.disconnect(); keep?.(null); chart.current?.destroy(); chart.current = null; };
  }, [shape, dark.value]);
  const pick = useRef(spec.pick);
  pick.current = spec.pick;
  useSignalEffect(draw);
  // What the picture closes over may have changed without a signal.
  useEffect(draw);
  return <div class="chart" ref={place} role="img" aria-label={label} />;
}

export function Legend({ lines }: { lines: readonly { label: string; style: number; value?: string }[] }) {
  return (
    <ul class="legend">
      {lines.map(({ label, style, value }) => (
        <li key={label}>
          <svg viewBox="0 0 40 10" aria-hidden="true" class={`trace-${style % 6}`}>
            <path d="M1 5H39" stroke="currentColor" stroke-width="2.5" stroke-dasharray={dashOf(style)} />
          </svg>
          {label}{value !== undefined && <b>{value}</b>}
        </li>
      ))}
    </ul>
  );
}
