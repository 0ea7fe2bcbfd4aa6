export { browserClock, ManualClock } from './clock.js';
export type { Clock } from './clock.js';
export { HtvmPlayerElement } from './element.js';
export type { FrameStamps } from './frame_stamps.js';
export type { LiveNumbers, LiveStateDetail, LiveStateName } from './live_state.js';
export type { LadderNumbers } from './ladder_numbers.js';
export type { FramePresentedDetail, PlayerErrorDetail, PlayerView, PlayerStatistics } from './details.js';
export { streamVersion, type Axis } from '@htvm/decoder';
import { HtvmPlayerElement } from './element.js';

if (!customElements.get('htvm-player')) customElements.define('htvm-player', HtvmPlayerElement);

declare global {
    interface HTMLElementTagNameMap {
        'htvm-player': HtvmPlayerElement;
    }
}
