// Files that the page makes.

export function download(name: string, content: Blob): void {
  const url = URL.createObjectURL(content);
  const link = document.createElement('a');
  link.href = url;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

/** The charts below each other, with the names of their curves. */
export function picture(canvases: readonly HTMLCanvasElement[], labels: readonly string[]): void {
  const ratio = devicePixelRatio;
  const head = 34 * ratio;
  const out = document.createElement('canvas');
  out.width = Math.max(1, ...canvases.map(({ width }) => width));
  out.height = canvases.reduce((sum, { height }) => sum + height, head);
  const ctx = out.getContext('2d')!;
  const style = getComputedStyle(document.documentElement);
  ctx.fillStyle = style.getPropertyValue('--surface').trim();
  ctx.fillRect(0, 0, out.width, out.height);
  ctx.font = `${14 * ratio}px system-ui, sans-serif`;
  ctx.textBaseline = 'middle';
  let left = 16 * ratio;
  labels.forEach((label, index) => {
    ctx.fillStyle = style.getPropertyValue(`--trace-${index % 6}`).trim();
    ctx.fillRect(left, head / 2 - 2 * ratio, 22 * ratio, 4 * ratio);
    ctx.fillStyle = style.getPropertyValue('--text').trim();
    ctx.fillText(label, left + 30 * ratio, head / 2);
    left += 50 * ratio + ctx.measureText(label).width;
  });
  let top = head;
  for (const canvas of canvases) {
    ctx.drawImage(canvas, 0, top);
    top += canvas.height;
  }
  out.toBlob((blob) => { if (blob !== null) download('axisd-scope.png', blob); });
}
