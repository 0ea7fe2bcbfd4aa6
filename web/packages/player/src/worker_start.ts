// Starts the worker from a file of its own, beside this one. Where the page is another site's than the file, browsers
// refuse that, and the file's text serves instead.

export async function startWorker(url: URL): Promise<Worker> {
    if (url.origin === location.origin || url.protocol === 'blob:') return new Worker(url);
    const response = await fetch(url);
    if (!response.ok) throw new Error(`${url} cannot be read (${response.status})`);
    const address = URL.createObjectURL(new Blob([await response.text()], { type: 'text/javascript' }));
    try {
        return new Worker(address);
    } finally {
        URL.revokeObjectURL(address);
    }
}
