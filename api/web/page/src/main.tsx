import { render } from 'preact';
import './style/page.css';
import './app';
import { startSettings } from './settings';
import { machine } from './route';
import { CellScreen } from './screens/cell';
import { session, type Machine } from './transport/session';
import { Login } from './ui/login';
import { Shell } from './ui/shell';

startSettings();

function Page() {
  const { at } = session.value;
  if (at === 'unknown') return null;
  if (at !== 'in') return <Login />;
  // A machine that there is not, or no longer: the list says which there are.
  const { machines } = session.value as { machines: readonly Machine[] };
  const known = machines.length === 0 ? machine === '' : machines.some(({ name }) => name === machine);
  return known ? <Shell /> : <CellScreen machines={machines} />;
}

render(<Page />, document.getElementById('page')!);
