// How the whole element looks.

export const styles = `
:host {
    --_ink: #1d232b; --_paper: #f4f5f7; --_paper2: #dde1e7; --_bar: rgba(255, 255, 255, 0.82); --_accent: #2563eb;
    display: block; position: relative; aspect-ratio: 4 / 3; overflow: hidden; contain: content; container-type: size;
    border-radius: 8px; color: var(--_ink); font: 13px/1.4 system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif;
    background: var(--htvm-background, radial-gradient(ellipse at 50% 35%, var(--_paper), var(--_paper2)));
    -webkit-user-select: none; user-select: none;
}
:host([hidden]) { display: none; }
:host(.dark) {
    --_ink: #e8ebf0; --_paper: #2b313b; --_paper2: #14171c; --_bar: rgba(24, 28, 34, 0.8); --_accent: #7aa2ff;
}
:host(.whole-window) { position: fixed !important; inset: 0 !important; z-index: 2147483647; width: 100vw !important; height: 100dvh !important; margin: 0 !important; aspect-ratio: auto !important; border-radius: 0; }
:host(:fullscreen) { border-radius: 0; aspect-ratio: auto; width: 100%; height: 100%; }
canvas { position: absolute; inset: 0; width: 100%; height: 100%; display: block; outline: none; touch-action: none; cursor: grab; }
canvas:active { cursor: grabbing; }
canvas:focus-visible { box-shadow: inset 0 0 0 2px var(--_accent); }
::slotted(*) { position: absolute; inset: 0; pointer-events: none; }
.poster { position: absolute; inset: 0; width: 100%; height: 100%; object-fit: contain; pointer-events: none; }
.bar {
    position: absolute; left: 10px; right: 10px; bottom: 10px; display: flex; align-items: center; gap: 2px; padding: 4px 6px;
    background: var(--_bar); border-radius: 10px; backdrop-filter: blur(10px); box-shadow: 0 1px 6px rgba(0, 0, 0, 0.18);
    transition: opacity 0.25s;
}
:host(.resting) .bar:not(:hover):not(:focus-within) { opacity: 0; }
[hidden] { display: none !important; }
button {
    all: unset; box-sizing: border-box; width: 34px; height: 34px; padding: 7px; border-radius: 7px; cursor: pointer;
    flex: none; color: inherit;
}
button:hover { background: color-mix(in srgb, currentColor 12%, transparent); }
button:focus-visible, select:focus-visible { outline: 2px solid var(--_accent); outline-offset: -2px; }
button[aria-pressed="true"] { color: var(--_accent); }
svg { display: block; width: 20px; height: 20px; fill: currentColor; }
.time { font-variant-numeric: tabular-nums; padding: 0 8px; white-space: nowrap; flex: none; }
.scrub { flex: 1; min-width: 40px; height: 26px; margin: 0 6px; background: none; -webkit-appearance: none; appearance: none; cursor: pointer; }
.scrub:focus-visible { outline: 2px solid var(--_accent); border-radius: 6px; }
.scrub::-webkit-slider-runnable-track {
    height: 4px; border-radius: 2px;
    background: linear-gradient(to right, var(--_accent) var(--done, 0%), color-mix(in srgb, currentColor 25%, transparent) var(--done, 0%));
}
.scrub::-moz-range-track { height: 4px; border-radius: 2px; background: color-mix(in srgb, currentColor 25%, transparent); }
.scrub::-moz-range-progress { height: 4px; border-radius: 2px; background: var(--_accent); }
.scrub::-webkit-slider-thumb { -webkit-appearance: none; width: 14px; height: 14px; margin-top: -5px; border-radius: 50%; background: var(--_accent); }
.scrub::-moz-range-thumb { width: 14px; height: 14px; border: 0; border-radius: 50%; background: var(--_accent); }
.scrub:disabled { opacity: 0.4; cursor: default; }
.rate { font: inherit; color: inherit; background: none; border: 0; border-radius: 7px; height: 34px; cursor: pointer; flex: none; }
.rate option { color: #000; background: #fff; }
.notice {
    position: absolute; left: 50%; top: 12px; transform: translateX(-50%); max-width: calc(100% - 40px); padding: 6px 12px;
    border-radius: 8px; background: var(--_bar); box-shadow: 0 1px 6px rgba(0, 0, 0, 0.18);
}
.livestate {
    position: absolute; right: 10px; top: 10px; max-width: 60%; padding: 3px 10px; border-radius: 8px; background: var(--_bar);
    box-shadow: 0 1px 6px rgba(0, 0, 0, 0.18); pointer-events: none;
}
.livestate::before { content: ''; display: inline-block; width: 8px; height: 8px; margin-right: 7px; border-radius: 50%; background: #94a3b8; }
.livestate.live::before { background: #dc2626; }
.livestate.behind::before { background: #d97706; }
.one-place :is(.back, .forward, .scrub, .loop), .one-rate .rate { display: none; }
.one-place .time { flex: 1; }
.unmute {
    position: absolute; left: 50%; bottom: 64px; transform: translateX(-50%); width: auto; height: auto; padding: 8px 16px;
    border-radius: 8px; background: var(--_bar); box-shadow: 0 1px 6px rgba(0, 0, 0, 0.18);
}
.failure { position: absolute; inset: 0; display: flex; align-items: center; justify-content: center; padding: 24px; text-align: center; user-select: text; -webkit-user-select: text; }
.failure > div { max-width: 46em; max-height: 100%; overflow-wrap: anywhere; padding: 14px 18px; border-radius: 10px; background: var(--_bar); box-shadow: 0 1px 6px rgba(0, 0, 0, 0.18); }
.failure strong { display: block; margin-bottom: 4px; }
.spinner {
    position: absolute; left: 50%; top: 50%; width: 36px; height: 36px; margin: -18px; border-radius: 50%; pointer-events: none;
    border: 3px solid color-mix(in srgb, currentColor 20%, transparent); border-top-color: var(--_accent);
    animation: turn 0.9s linear infinite;
}
@keyframes turn { to { transform: rotate(1turn); } }
@media (prefers-reduced-motion: reduce) { .spinner { animation-duration: 6s; } .bar { transition: none; } }
.panel {
    position: absolute; left: 10px; top: 10px; margin: 0; padding: 8px 12px; border-radius: 8px; background: var(--_bar);
    font: 11.5px/1.55 ui-monospace, "DejaVu Sans Mono", Menlo, Consolas, monospace; white-space: pre; pointer-events: none;
    box-shadow: 0 1px 6px rgba(0, 0, 0, 0.18);
}
.description { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); }
@container (max-width: 620px) { .back, .forward, .screenshot { display: none; } }
@container (max-width: 470px) { .rate, .statistics, .light { display: none; } }
@container (max-width: 330px) { .time { display: none; } }
`;
