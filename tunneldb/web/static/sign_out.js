/** Sign out: nothing of the user stays on the device, and what the database does not have yet is not dropped without a word. */

import { post, withoutSignIn } from './api.js';
import { button, el } from './dom.js';
import { removeAll } from './held.js';

/** Sign out, and remove all that the device holds of the user, also if the session has ended already. */
export async function signOut(outbox) {
  await withoutSignIn(async () => {
    if (!(await mayLeave(outbox))) return;
    await post('/logout').catch((error) => {
      if (error.status !== 401) throw error;
    });
    await outbox.clear();
    await removeAll();
    location.assign('/login');
  });
}

/** Return true if nothing waits for the database, or the person signs out in spite of it. */
async function mayLeave(outbox) {
  await outbox.send();
  const count = outbox.records.length;
  if (!count) return true;
  return new Promise((resolve) => {
    const dialog = el('dialog', { 'aria-labelledby': 'leave-title' },
      el('h2', { id: 'leave-title', text: `Not in the database yet: ${count}` }),
      el('p', { text: 'What was recorded on this device is removed when you sign out.' }),
      el('div', { class: 'row' }, button('Sign out and remove', () => dialog.close('leave'), { class: 'danger' }), button('Stay', () => dialog.close(), { autofocus: true })));
    dialog.addEventListener('close', () => {
      dialog.remove();
      resolve(dialog.returnValue === 'leave');
    });
    document.body.append(dialog);
    dialog.showModal();
  });
}
