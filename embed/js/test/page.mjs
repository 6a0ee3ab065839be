// The example page in headless Chromium: it shows the tracks and the dirty ranges of a stream, and the fault of another.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { createServer } from 'node:http';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

const root = new URL('../../../', import.meta.url);
const types = { html: 'text/html', js: 'text/javascript', wasm: 'application/wasm' };

/** What the page gets beside its own: it sends its texts here once they are there. */
const REPORT = `<script>
    const faults = [];
    addEventListener('error', ({ message }) => faults.push(message));
    addEventListener('unhandledrejection', ({ reason }) => faults.push(String(reason)));
    const timer = setInterval(() => {
        const text = (id) => document.getElementById(id).innerText;
        if (text('status') === 'Loading.') return;
        clearInterval(timer);
        const bars = document.querySelectorAll('canvas').length;
        const texts = Object.fromEntries(['status', 'error', 'tracks', 'frames'].map((id) => [id, text(id)]));
        fetch('/report', { method: 'POST', body: JSON.stringify({ ...texts, bars, faults }) });
    }, 50);
</script>`;

let report;
const server = createServer(async (request, response) => {
    const { pathname } = new URL(request.url, 'http://localhost');
    if (pathname === '/report') {
        let text = '';
        for await (const chunk of request) text += chunk;
        response.end();
        report(JSON.parse(text));
        return;
    }
    try {
        const damaged = pathname === '/damaged.dapple';
        const bytes = readFileSync(new URL(damaged ? 'spec/examples/probes.dapple' : `.${pathname}`, root));
        if (damaged) bytes[bytes.length - 1] ^= 1;
        response.setHeader('content-type', types[pathname.split('.').pop()] ?? 'application/octet-stream');
        response.write(bytes);
        response.end(pathname.endsWith('.html') ? REPORT : undefined);
    } catch {
        response.statusCode = 404;
        response.end();
    }
});
await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));

/** What the page shows. */
async function page(query) {
    const reported = new Promise((resolve, reject) => {
        report = resolve;
        setTimeout(() => reject(new Error('the page did not report within a minute')), 60_000).unref();
    });
    const profile = mkdtempSync(join(tmpdir(), 'dapple-page-'));
    const url = `http://127.0.0.1:${server.address().port}/embed/js/example/index.html${query}`;
    const options = ['--headless=new', '--no-sandbox', '--disable-gpu', `--user-data-dir=${profile}`];
    const chromium = spawn('chromium', [...options, url], { stdio: 'ignore' });
    const ended = new Promise((resolve) => chromium.on('close', resolve));
    try {
        return await reported;
    } finally {
        chromium.kill('SIGKILL');
        await ended;
        rmSync(profile, { recursive: true, force: true, maxRetries: 10, retryDelay: 100 });
    }
}

const good = await page('');
assert.match(good.status, /^2 frames, \d+ bytes, digest [0-9a-f]{16}\.$/);
assert.deepEqual([good.error, good.faults], ['', []]);
assert.match(good.tracks, /court/);
assert.match(good.frames, /frame 1\s+ProbesTexels of track 1\s+56 of 168 bytes/);
assert.equal(good.bars, good.frames.match(/frame \d/g).length);
const bad = await page('?stream=/damaged.dapple');
assert.match(bad.error, /^E1011 payload-checksum, at byte \d+: a record payload is damaged$/);
assert.match(bad.status, /^2 frames before the fault\.$/);
const none = await page('?stream=/none.dapple');
assert.match(none.error, /404 Not Found/);
server.close();
console.log('The example page works in Chromium.');
