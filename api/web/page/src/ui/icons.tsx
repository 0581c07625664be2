// Pictures of the navigation, each beside its word.
import type { JSX } from 'preact';

const icon = (path: JSX.Element) => (
  <svg class="icon" viewBox="0 0 24 24" fill="none" stroke="currentColor" stroke-width="1.75" stroke-linecap="round"
       stroke-linejoin="round" aria-hidden="true">{path}</svg>
);

export const icons: { readonly [id: string]: JSX.Element } = {
  machine: icon(<path d="M4 6h16M4 12h16M4 18h16M8 4v4M15 10v4M11 16v4" />),
  axis: icon(<path d="M3 12h18M6 9l-3 3 3 3M18 9l3 3-3 3M12 7v10" />),
  scope: icon(<path d="M3 4v16h18M6 15l4-6 4 4 5-7" />),
  groups: icon(<path d="M4 7h11M12 4l3 3-3 3M4 17h11M12 14l3 3-3 3M20 4v16" />),
  terminals: icon(<path d="M5 5h14v14H5zM9 9h0M15 9h0M9 15h0M15 15h0" />),
  buses: icon(<path d="M2 12h20M6 12V6M12 12v6M18 12V6M4 6h4M10 18h4M16 6h4" />),
  events: icon(<path d="M8 6h13M8 12h13M8 18h13M3.5 6h.5M3.5 12h.5M3.5 18h.5" />),
  people: icon(<path d="M9 11a3.5 3.5 0 1 0 0-7 3.5 3.5 0 0 0 0 7zM2.5 20c0-3.5 3-6 6.5-6s6.5 2.5 6.5 6M16 4.5a3.5 3.5 0 0 1 0 6M18 14.5c2.2.9 3.5 3 3.5 5.5" />),
};
