// A player that starts before anybody has clicked on the page.
import '/listen.js';
import '/player/htvm-player.js';

const player = document.createElement('htvm-player');
for (const [name, value] of Object.entries({ src: '/as-is/sound.htvm', autoplay: '', loop: '', floor: 'none' })) player.setAttribute(name, value);
let shown = 0;
player.addEventListener('framepresented', () => {
    if (++shown === 10) console.log('ten frames');
});
document.body.append(player);
listen.watch(player);
Object.assign(window, { player, notices: [] });
