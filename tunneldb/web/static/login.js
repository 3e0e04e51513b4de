/** Sign in: the part of the address after # stays, and so does the place on the desk that was asked for. */

const form = document.querySelector('form');
form.action = `/login${location.hash}`;
window.addEventListener('hashchange', () => { form.action = `/login${location.hash}`; });
