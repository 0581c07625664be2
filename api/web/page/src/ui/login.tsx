import { useSignal } from '@preact/signals';
import { t } from '../i18n';
import { session, signIn, refreshSession } from '../transport/session';
import { spanText } from '../model/numbers';
import { LanguageChoice } from './choices';

/** Name and password; where the gateway does not answer, that. */
export function Login() {
  const refusal = useSignal('');
  const busy = useSignal(false);
  const gone = session.value.at === 'unreachable';
  const submit = async (event: SubmitEvent) => {
    event.preventDefault();
    if (busy.peek()) return;
    const data = new FormData(event.currentTarget as HTMLFormElement);
    busy.value = true;
    const refused = await signIn(String(data.get('name')), String(data.get('password')));
    busy.value = false;
    if (refused === null) return;
    const wait = refused.retryAfterMs > 0 ? ` ${t('login.wait', { time: spanText(refused.retryAfterMs) })}` : '';
    refusal.value = `${refused.message || refused.reason}${wait}`;
  };
  return (
    <main class="login">
      <form class="card" onSubmit={submit}>
        <h1>axisd</h1>
        {gone ? (
          <>
            <p role="alert">{t('login.unreachable')}</p>
            <button type="button" class="button primary" onClick={() => void refreshSession()}>{t('action.reconnect')}</button>
          </>
        ) : (
          <>
            <p>{t('login.text')}</p>
            <label class="field"><span class="caption">{t('login.name')}</span>
              <span class="box"><input name="name" type="text" autocomplete="username" required autofocus /></span></label>
            <label class="field"><span class="caption">{t('login.password')}</span>
              <span class="box"><input name="password" type="password" autocomplete="current-password" required /></span></label>
            {refusal.value !== '' && <p class="alarm-text" role="alert">{refusal.value}</p>}
            <button class="button primary" type="submit" aria-disabled={busy.value}>{busy.value ? t('login.busy') : t('login.enter')}</button>
          </>
        )}
        <LanguageChoice />
      </form>
    </main>
  );
}
