// Machines of a cell: the entrance of a cell names axes `machine/axis`, a machine alone names them plainly.

/** Of an axis name; empty: there is no cell. */
export function machineOf(axis: string): string {
  const slash = axis.indexOf('/');
  return slash < 0 ? '' : axis.slice(0, slash);
}

/** Within its machine. */
export function plainName(axis: string): string {
  return axis.slice(axis.indexOf('/') + 1);
}

/** In the order in which they appear. */
export function machinesOf(axes: readonly string[]): string[] {
  return [...new Set(axes.map(machineOf))].filter((name) => name !== '');
}
