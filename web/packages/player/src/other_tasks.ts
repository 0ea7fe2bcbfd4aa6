/** Lets messages be heard between two pieces of work. A timer would wait for 4 ms. */
export function otherTasks(): Promise<void> {
    return new Promise((resolve) => {
        const { port1, port2 } = new MessageChannel();
        port1.onmessage = () => {
            port1.close();
            resolve();
        };
        port2.postMessage(null);
    });
}
