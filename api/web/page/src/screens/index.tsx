import { useEffect } from 'preact/hooks';
import { store } from '../app';
import { t } from '../i18n';
import { lastAxis, route } from '../route';
import { AxisScreen } from './axis';
import { BusesScreen } from './buses';
import { EventsScreen } from './events';
import { GroupsScreen } from './groups';
import { MachineScreen } from './machine';
import { PeopleScreen } from './people';
import { ScopeScreen } from './scope';
import { TerminalsScreen } from './terminals';

export function Screen() {
  const { screen, of } = route.value;
  const names = store.names.value;
  const axis = names.includes(of) ? of : lastAxis.value || names[0] || '';
  useEffect(() => { if (screen === 'axis' && axis !== '') lastAxis.value = axis; }, [screen, axis]);
  useEffect(() => { document.title = `${screen === 'axis' ? axis : t(`nav.${screen}` as 'nav.machine')} · ${store.info.peek()?.machine ?? 'axisd'}`; });
  switch (screen) {
    case 'axis': return axis === '' ? <p class="empty">{t('page.no-axes')}</p> : <AxisScreen key={axis} name={axis} />;
    case 'scope': return <ScopeScreen />;
    case 'buses': return <BusesScreen />;
    case 'terminals': return <TerminalsScreen />;
    case 'groups': return <GroupsScreen />;
    case 'events': return <EventsScreen />;
    case 'people': return <PeopleScreen />;
    default: return <MachineScreen />;
  }
}
