// The machines of a gateway that serves several: how each is, and the way to its own page.
import { useSignal } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import { LinkState, State, type AxisState } from '@proto/types_pb';
import { visible } from '../app';
import { t } from '../i18n';
import { stopMachines } from '../stops';
import { CALL_MS, clientsOf, problem } from '../transport/clients';
import { refreshSession, session, type Machine } from '../transport/session';
import { LanguageChoice, PanelChoice, ThemeChoice } from '../ui/choices';
import { pressed, StopReportView } from '../ui/stop-rail';
import { axesText } from '../ui/words';

const EVERY = 2000;

/** What a machine says of itself; `trouble`: why it says nothing. */
interface Seen { trouble: string; axes: readonly AxisState[]; inhibitedBy: string | null }

async function look(machine: Machine): Promise<Seen> {
  const silent = (trouble: string): Seen => ({ trouble, axes: [], inhibitedBy: null });
  if (machine.trouble !== '') return silent(machine.trouble);
  const { axes, system } = clientsOf(machine.name);
  try {
    const info = await system.getInfo({}, { timeoutMs: CALL_MS });
    const { axes: states } = await axes.listAxes({}, { timeoutMs: CALL_MS });
    return { trouble: '', axes: states, inhibitedBy: info.inhibited ? info.inhibitedBy : null };
  } catch (error) {
    return silent(problem(error).message);
  }
}

function words({ trouble, axes, inhibitedBy }: Seen): string {
  if (trouble !== '') return t('cell.silent', { why: trouble });
  const count = (holds: (state: AxisState) => boolean) => axes.filter(holds).length;
  const moving = count((state) => state.moving);
  const faulty = count((state) => state.state === State.ERROR_STOP);
  const offline = count((state) => state.link === LinkState.OFFLINE);
  return [axesText(axes.length), moving > 0 && t('cell.moving', { count: moving }), faulty > 0 && t('cell.faulty', { count: faulty }),
          offline > 0 && t('cell.offline', { count: offline }), inhibitedBy !== null && `${t('stop.all')} ${t('inhibit.by', { who: inhibitedBy || '?' })}`]
    .filter(Boolean).join(' · ');
}

export function CellScreen({ machines }: { machines: readonly Machine[] }) {
  const seen = useSignal<ReadonlyMap<string, Seen>>(new Map());
  useEffect(() => {
    let timer: ReturnType<typeof setTimeout> | undefined;
    let over = false;
    const refresh = async () => {
      if (visible.peek()) {
        await refreshSession();
        const now = session.peek();
        const known = now.at === 'in' ? now.machines : [];
        seen.value = new Map(await Promise.all(known.map(async (machine) => [machine.name, await look(machine)] as const)));
      }
      if (!over) timer = setTimeout(() => void refresh(), EVERY);
    };
    void refresh();
    document.title = t('cell.machines');
    return () => { over = true; clearTimeout(timer); };
  }, []);
  const who = session.value.at === 'in' ? session.value.name : '';
  return (
    <div class="shell">
      <header><span class="machine">{t('cell.machines')}</span><span class="fact">{who}</span></header>
      <div class="stops" role="region" aria-label={t('stop.region')}>
        <button class="stop all" data-stop="all" {...pressed(() => void stopMachines(machines.map(({ name }) => name)))}>
          {t('stop.all')}<span class="of">{t('cell.all')}</span></button>
      </div>
      <div class="middle">
        <StopReportView />
        <main tabIndex={0}>
          <h1 class="unseen">{t('cell.machines')}</h1>
          <table class="axes">
            <caption class="unseen">{t('cell.machines')}</caption>
            <thead><tr><th scope="col">{t('nav.machine')}</th><th scope="col">{t('column.state')}</th><th scope="col"><span class="unseen">{t('stop.all')}</span></th></tr></thead>
            <tbody>{machines.map(({ name }) => {
              const now = seen.value.get(name);
              return (
                <tr key={name} data-machine={name} class={now !== undefined && now.trouble !== '' ? 'alarm' : ''}>
                  <th scope="row"><a href={`/@${name}/machine`}>{name}</a></th>
                  <td>{now === undefined ? t('live.connecting') : words(now)}</td>
                  <td class="act"><button class="stop small" data-stop={name} {...pressed(() => void stopMachines([name]))}
                                          aria-label={`${t('stop.all')} ${name}`}>{t('stop.all')}</button></td>
                </tr>
              );
            })}</tbody>
          </table>
          <div class="settings">
            <span class="caption">{t('settings.language')}</span><LanguageChoice />
            <span class="caption">{t('settings.theme')}</span><ThemeChoice />
            <span class="caption">{t('settings.size')}</span><PanelChoice />
          </div>
        </main>
      </div>
    </div>
  );
}
