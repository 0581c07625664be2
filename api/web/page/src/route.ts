// Which screen is shown: the path of the address, so that it can be linked to and the browser's own buttons work.
import { computed, signal } from '@preact/signals';
import type { Key } from './i18n';

export interface Place {
  id: string;
  title: Key;
  /** False: its place is kept, and there is no screen yet. */
  ready: boolean;
}

/** In the order of the navigation. */
export const places: readonly Place[] = [
  { id: 'machine', title: 'nav.machine', ready: true },
  { id: 'axis', title: 'nav.axis', ready: true },
  { id: 'scope', title: 'nav.scope', ready: true },
  { id: 'groups', title: 'nav.groups', ready: true },
  { id: 'terminals', title: 'nav.terminals', ready: true },
  { id: 'buses', title: 'nav.buses', ready: true },
  { id: 'events', title: 'nav.events', ready: true },
  { id: 'people', title: 'nav.people', ready: true },
  { id: 'commissioning', title: 'nav.commissioning', ready: false },
  { id: 'configuration', title: 'nav.configuration', ready: false },
  { id: 'flight-records', title: 'nav.flight-records', ready: false },
  { id: 'parameters', title: 'nav.parameters', ready: false },
];

export interface Route { screen: string; of: string }

/** "/axis/feeder": the screen, and what it is of. What is not known is the machine's screen. */
export function parse(path: string): Route {
  const [, screen = '', ...rest] = path.split('/');
  const known = places.some(({ id, ready }) => ready && id === screen);
  return known ? { screen, of: decodeURIComponent(rest.join('/')) } : { screen: 'machine', of: '' };
}

/** "/@press-1/axis/feeder": the machine, of a gateway that serves several, and the rest. */
export function split(path: string): { machine: string; path: string } {
  const [, name = '', rest = ''] = /^\/@([a-z][a-z0-9_-]*)(\/.*)?$/.exec(path) ?? [];
  return name === '' ? { machine: '', path } : { machine: name, path: rest || '/' };
}

const asked = split(typeof location === 'undefined' ? '/' : location.pathname);
/** What this page is of; empty: there is one machine, or none was chosen yet. Another one is another page: nothing of this one,
 * no control of an axis above all, goes along. */
export const { machine } = asked;
const path = signal(asked.path);
export const route = computed(() => parse(path.value));
/** The axis that was looked at last: STOP beside STOP ALL is for it. */
export const lastAxis = signal('');

const within = (screen: string, of: string) => `/${screen}${of === '' ? '' : `/${of.split('/').map(encodeURIComponent).join('/')}`}`;
export const hrefOf = (screen: string, of = ''): string => `${machine === '' ? '' : `/@${machine}`}${within(screen, of)}`;

export function go(screen: string, of = ''): void {
  const next = within(screen, of);
  if (next === path.peek()) return;
  history.pushState(null, '', hrefOf(screen, of));
  path.value = next;
  document.querySelector('main')?.scrollTo(0, 0);
}

if (typeof addEventListener === 'function' && typeof location !== 'undefined') {
  addEventListener('popstate', () => {
    const now = split(location.pathname);
    if (now.machine === machine) path.value = now.path;
    else location.reload();
  });
}
