// Curves over time, drawn by uPlot: only when new samples came, not with each frame.
import uPlot from 'uplot';
import type { Trace } from '../model/series';
import { align } from '../model/series';
import { shown } from '../model/numbers';
import { dashes, type ChartSpec, type Mark } from './chart-spec';

const colour = (name: string): string => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** "17:42:03" or "1.25", as close as the marks of the axis are. */
function timeLabel(clock: boolean, at: number, step: number): string {
  const digits = step >= 1 ? 0 : step >= 0.1 ? 1 : step >= 0.01 ? 2 : 3;
  if (!clock) return `${shown(at, digits)} s`;
  const date = new Date(at * 1000);
  const two = (value: number) => String(value).padStart(2, '0');
  const seconds = two(date.getSeconds()) + (digits === 0 ? '' : (at % 1).toFixed(digits).slice(1));
  return `${two(date.getHours())}:${two(date.getMinutes())}:${seconds}`;
}

export class Chart {
  readonly plot: uPlot;
  private marks: readonly Mark[] = [];

  constructor(private readonly place: HTMLElement, private readonly spec: ChartSpec) {
    const text = colour('--muted');
    const grid = colour('--line');
    const font = '13px system-ui, sans-serif';
    const scales = [...new Set(spec.lines.map(({ scale }) => scale))];
    const axis = (scale: string, index: number): uPlot.Axis => ({
      scale, side: index === 0 ? 3 : 1, stroke: text, font, size: 74, gap: 6, labelFont: font, label: scale, labelSize: 18, labelGap: 2,
      grid: { stroke: grid, width: 1, show: index === 0 }, ticks: { show: false },
      values: (_, splits) => {
        const step = Math.abs((splits[1] ?? 0) - (splits[0] ?? 0));
        return splits.map((value) => shown(value, step >= 1 ? 0 : step >= 0.1 ? 1 : step >= 0.01 ? 2 : 3));
      },
    });
    this.plot = new uPlot({
      width: Math.max(200, place.clientWidth), height: spec.height, padding: [10, scales.length > 1 ? 0 : 34, 0, 0],
      legend: { show: false }, cursor: { drag: { x: false, y: false }, points: { show: false }, y: false },
      scales: { x: { time: false }, ...Object.fromEntries(scales.map((scale) => [scale, {
        range: (_: uPlot, low: number | null, high: number | null): [number, number] => {
          if (low === null || high === null) return [-1, 1];
          const room = Math.max((high - low) * 0.08, Math.abs(high) * 0.002, 0.05);
          return [low - room, high + room];
        } }])) },
      axes: [
        { stroke: text, font, grid: { stroke: grid, width: 1 }, ticks: { show: false }, space: 90, size: 30,
          values: (_, splits) => splits.map((at) => timeLabel(spec.clock, at, Math.abs((splits[1] ?? 0) - (splits[0] ?? 0)))) },
        ...scales.map(axis)],
      series: [{}, ...spec.lines.map(({ label, scale, style, stepped }): uPlot.Series => ({
        label, scale, stroke: colour(`--trace-${style % 6}`), width: style % 6 === 0 ? 2 : 1.75, spanGaps: true, points: { show: false },
        ...(dashes[style % 6] ? { dash: dashes[style % 6]! } : {}),
        ...(stepped ? { paths: uPlot.paths.stepped!({ align: 1 }) } : {}),
      }))],
      hooks: { draw: [(plot) => this.drawMarks(plot)] },
    }, [[0], ...spec.lines.map(() => [null])] as unknown as uPlot.AlignedData, place);
    if (spec.pick) {
      this.plot.over.addEventListener('pointerdown', (event) => {
        const box = this.plot.over.getBoundingClientRect();
        spec.pick!(this.plot.posToVal(event.clientX - box.left, 'x'));
      });
    }
  }

  /** Draws traces (times in seconds) between two times. */
  show(traces: readonly Trace[], from: number, to: number, marks: readonly Mark[]): void {
    this.marks = marks;
    const width = this.place.clientWidth;
    if (width > 0 && width !== this.plot.width) this.plot.setSize({ width, height: this.spec.height });
    this.plot.batch(() => {
      this.plot.setData(align(traces) as unknown as uPlot.AlignedData, false);
      // Axes follow the values in sight.
      this.plot.setScale('x', { min: from, max: to });
    });
  }

  destroy(): void { this.plot.destroy(); }

  private drawMarks(plot: uPlot): void {
    const { ctx, bbox } = plot;
    const ratio = devicePixelRatio;
    ctx.save();
    ctx.strokeStyle = colour('--text');
    ctx.fillStyle = colour('--text');
    ctx.lineWidth = ratio;
    ctx.font = `${12 * ratio}px system-ui, sans-serif`;
    ctx.textBaseline = 'top';
    for (const { at, text, style } of this.marks) {
      const x = plot.valToPos(at, 'x', true);
      if (x < bbox.left || x > bbox.left + bbox.width) continue;
      ctx.setLineDash(style === 'dashed' ? [4 * ratio, 4 * ratio] : []);
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      const wide = ctx.measureText(text).width;
      const left = x + wide + 8 * ratio > bbox.left + bbox.width;
      ctx.fillText(text, left ? x - wide - 4 * ratio : x + 4 * ratio, bbox.top + 2 * ratio);
    }
    ctx.restore();
  }
}
