// Whether a click is still meant: a page that was too busy to hear it hears it when nobody waits for it any more.
import { notify } from './notices';

const LATE_MS = 500;

/** What a click brings about, unless it comes too late, which is said then. */
export const ifMeant = (run: () => void) => (event: MouseEvent): void => {
  if (performance.now() - event.timeStamp <= LATE_MS) run();
  else notify('warning', { key: 'page.late-click' });
};
