import { render } from 'preact';
import './style/page.css';
import './app';
import { startSettings } from './settings';
import { machine } from './route';
import { CellScreen } from './screens/cell';
import { serves, session } from './transport/session';
import { Login } from './ui/login';
import { Shell } from './ui/shell';

startSettings();

function Page() {
  const now = session.value;
  if (now.at === 'unknown') return null;
  if (now.at !== 'in') return <Login />;
  // None was chosen yet, or there is none of that name: the list says which there are.
  return serves(now, machine) ? <Shell /> : <CellScreen machines={now.machines} />;
}

render(<Page />, document.getElementById('page')!);
