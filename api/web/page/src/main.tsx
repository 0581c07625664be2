import { render } from 'preact';
import './style/page.css';
import './app';
import { startSettings } from './settings';
import { session } from './transport/session';
import { Login } from './ui/login';
import { Shell } from './ui/shell';

startSettings();

function Page() {
  const { at } = session.value;
  if (at === 'unknown') return null;
  return at === 'in' ? <Shell /> : <Login />;
}

render(<Page />, document.getElementById('page')!);
