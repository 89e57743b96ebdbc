// Browsers refuse workers to a page that is opened from a folder: a hidden frame does their work, and
// the search with it. The search's script looks for `IFrameWorker` to tell that it is in a frame, and
// the theme for a file of this name, else it would have readers fetch one.
"use strict";

class FrameWorker extends EventTarget {
  constructor(url) {
    super();
    const frame = Object.assign(document.createElement("iframe"), { hidden: true });
    document.body.append(frame);
    const inside = frame.contentWindow;
    inside.document.open(); // else some browsers put an empty document there a moment later
    inside.document.write("<!doctype html><body></body>");
    inside.document.close();
    inside.postMessage = data => this.#tell(data);
    inside.importScripts = (...urls) => Promise.all(urls.map(one => load(inside, one)));
    this.onmessage = null;
    this.frame = frame;
    this.ready = load(inside, url);
  }

  postMessage(data) {
    const { contentWindow } = this.frame;
    this.ready.then(() => contentWindow.dispatchEvent(new contentWindow.MessageEvent("message", { data })));
  }

  terminate() {
    this.frame.remove();
  }

  #tell(data) {
    const event = new MessageEvent("message", { data });
    this.dispatchEvent(event);
    this.onmessage?.(event);
  }
}

function load(inside, url) {
  const script = inside.document.createElement("script");
  return new Promise((resolve, reject) => {
    Object.assign(script, { onload: resolve, onerror: reject, src: new URL(url, document.baseURI) });
    inside.document.body.append(script);
  });
}

if (location.protocol === "file:") window.Worker = window.IFrameWorker = FrameWorker;
