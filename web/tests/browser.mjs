// Chromium, drawing in software.
import { chromium } from 'playwright-core';

export function launch(more = []) {
    return chromium.launch({
        executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
        args: [
            '--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist',
            '--enable-precise-memory-info', '--js-flags=--expose-gc', '--autoplay-policy=document-user-activation-required', ...more,
        ],
    });
}
