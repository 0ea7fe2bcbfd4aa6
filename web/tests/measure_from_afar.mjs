// A stream with pictures, drawn small in Chromium, beside the mean of the same picture drawn large:
//
//   node web/tests/measure_from_afar.mjs FILE.htvm
//
// With means of so many texels across and down as the player takes at most (4), and with fewer and more, for which its shader is
// changed. Prints PSNR in what is covered as a whole, and how many pixels are off by more than 25 of 255.
import { basename, dirname } from 'node:path';
import { fileURLToPath } from 'node:url';
import { launch } from './browser.mjs';
import { TestServer } from './server.mjs';

const path = (relative) => fileURLToPath(new URL(relative, import.meta.url));
const file = process.argv[2];
const sizes = [60, 100, 150, 200, 300]; // pixels
const large = 900;

const server = await new TestServer({ '': path('pages'), player: path('../packages/player/dist'), streams: dirname(file) }).start();
const browser = await launch();

async function drawn(most) {
    const page = await browser.newPage({ viewport: { width: large, height: large } });
    await page.addInitScript(`{
        const { shaderSource } = WebGL2RenderingContext.prototype;
        WebGL2RenderingContext.prototype.shaderSource = function (shader, text) {
            shaderSource.call(this, shader, text.replace('1.0, 4.0)', '1.0, ${most}.0)').replaceAll('8.0 / max(texels', '${2 * most}.0 / max(texels'));
        };
    }`);
    await page.goto(`${server.origin}/page.html`);
    await page.waitForFunction('window.ready');
    const rows = await page.evaluate(async ([src, sizes, large]) => {
        const size = async (pixels) => {
            Object.assign(test.player.style, { width: `${pixels}px`, height: `${pixels}px` });
            await new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve, 50))); // until it is observed
            await test.player.idle();
        };
        const pixels = async () => {
            const bitmap = await createImageBitmap(await test.player.screenshot());
            const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
            context.drawImage(bitmap, 0, 0);
            return context.getImageData(0, 0, bitmap.width, bitmap.height).data;
        };
        await test.open({ src, orbit: '0 5' });
        const { view } = test.player;
        const rows = [];
        for (const yaw of [0, 90]) for (const n of sizes) {
            const times = Math.round(large / n);
            const side = n * times;
            await size(side);
            test.player.view = { ...view, yaw };
            await test.player.idle();
            const whole = await pixels();
            const mean = new Float32Array(4 * n * n);
            for (let y = 0; y < side; ++y)
                for (let x = 0; x < side; ++x)
                    for (let c = 0; c < 4; ++c) mean[4 * (Math.floor(y / times) * n + Math.floor(x / times)) + c] += whole[4 * (y * side + x) + c] / times ** 2;
            await size(n);
            const small = await pixels();
            let [squared, count, off] = [0, 0, 0];
            for (let i = 0; i < n * n; ++i) {
                if (mean[4 * i + 3] < 254.5 || small[4 * i + 3] < 255) continue;
                const errors = [0, 1, 2].map((c) => Math.abs(small[4 * i + c] - mean[4 * i + c]));
                squared += errors.reduce((sum, error) => sum + error ** 2, 0);
                ++count;
                if (Math.max(...errors) > 25) ++off;
            }
            rows.push([yaw, n, 10 * Math.log10((3 * count * 255 ** 2) / squared), (100 * off) / count]);
        }
        return rows;
    }, [`/as-is/${basename(file)}`, sizes, large]);
    await page.close();
    return rows;
}

for (const most of [1, 2, 4, 8])
    for (const [yaw, n, psnr, off] of await drawn(most))
        console.log(`${most} x ${most}, from ${yaw} degrees, ${n} pixels: ${psnr.toFixed(1)} dB, ${off.toFixed(2)} % off`);
await browser.close();
server.stop();
