// Dropping, pasting and taking photos, and drawing the object's box. See page.py.
(() => {
  if (window.r2art) return;
  window.r2art = true;
  document.title = 'r2art';

  const zone = () => document.querySelector('.r2art-drop');
  const part = (name) => zone().querySelector('.r2art-' + name);
  let stream = null;

  function complain(text) {
    const place = part('error');
    place.textContent = text;
    place.hidden = !text;
  }

  // Into viser's upload button, as if chosen there.
  function send(file) {
    complain('');
    const limit = Number(zone().dataset.limit);
    if (file.size > limit) {
      const mb = (bytes) => (bytes / 1e6).toFixed(1) + ' MB';
      complain(file.name + ' has ' + mb(file.size) + ', the limit is ' + mb(limit));
      return;
    }
    const input = document.querySelector('input[type=file]');
    const files = new DataTransfer();
    files.items.add(file);
    input.files = files.files;
    input.dispatchEvent(new Event('change', { bubbles: true }));
  }

  // Into a text field of viser's, as if typed.
  function type(label, text) {
    const labels = [...document.querySelectorAll('label')];
    let place = labels.find((e) => e.textContent === label);
    while (place && !place.querySelector('input')) place = place.parentElement;
    if (!place) return;
    const input = place.querySelector('input');
    const value = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value');
    value.set.call(input, text);
    input.dispatchEvent(new Event('input', { bubbles: true }));
  }

  // The file chosen with viser's own button passes here first.
  document.addEventListener('change', (event) => {
    const file = event.target.type === 'file' && event.target.files[0];
    if (!file || !zone()) return;
    complain('');
    if (file.size > Number(zone().dataset.limit)) {
      event.stopImmediatePropagation();
      send(file);
    }
  }, true);

  const holdsFile = (event) => zone() && [...event.dataTransfer.types].includes('Files');
  document.addEventListener('dragover', (event) => {
    if (!holdsFile(event)) return;
    event.preventDefault();
    zone().classList.add('r2art-over');
  });
  document.addEventListener('dragleave', (event) => {
    if (!event.relatedTarget && zone()) zone().classList.remove('r2art-over');
  });
  document.addEventListener('drop', (event) => {
    if (!holdsFile(event)) return;
    event.preventDefault();
    zone().classList.remove('r2art-over');
    send(event.dataTransfer.files[0]);
  });
  document.addEventListener('paste', (event) => {
    if (zone() && event.clipboardData.files.length) send(event.clipboardData.files[0]);
  });

  async function watch() {
    complain('');
    if (!navigator.mediaDevices) {
      complain('Browsers lend the webcam to pages of this machine (127.0.0.1) and to https only.');
      return;
    }
    try {
      stream = await navigator.mediaDevices.getUserMedia({ video: { width: { ideal: 1280 } } });
    } catch (error) {
      complain('No webcam: ' + error.message);
      return;
    }
    zone().querySelector('video').srcObject = stream;
    part('idle').hidden = true;
    part('live').hidden = false;
  }
  function unwatch() {
    if (stream) stream.getTracks().forEach((track) => track.stop());
    stream = null;
    part('idle').hidden = false;
    part('live').hidden = true;
  }
  function take() {
    const video = zone().querySelector('video');
    if (!video.videoWidth) return;
    const canvas = document.createElement('canvas');
    canvas.width = video.videoWidth;
    canvas.height = video.videoHeight;
    canvas.getContext('2d').drawImage(video, 0, 0);
    unwatch();
    canvas.toBlob((blob) => send(new File([blob], 'webcam.jpg', { type: blob.type })), 'image/jpeg', 0.95);
  }
  document.addEventListener('click', (event) => {
    if (event.target.closest('.r2art-webcam')) watch();
    if (event.target.closest('.r2art-take')) take();
    if (event.target.closest('.r2art-cancel')) unwatch();
  });

  // A drag on the photo draws a box; one that starts at a corner of the box moves that corner.
  let drawing = null;
  function at(photo, event) {
    const frame = photo.getBoundingClientRect();
    const share = (v) => Math.min(1, Math.max(0, v));
    return [
      share((event.clientX - frame.left) / frame.width),
      share((event.clientY - frame.top) / frame.height),
    ];
  }
  document.addEventListener('pointerdown', (event) => {
    const photo = event.target.closest('.r2art-photo');
    if (!photo || event.button !== 0) return;
    event.preventDefault();
    const box = photo.querySelector('.r2art-box');
    const corner = event.target.closest('.r2art-box i');
    let start = at(photo, event);
    if (corner) {
      const i = [...box.children].indexOf(corner);
      const [frame, b] = [photo.getBoundingClientRect(), box.getBoundingClientRect()];
      const x = i % 2 ? b.left : b.right;
      const y = i > 1 ? b.top : b.bottom;
      start = [(x - frame.left) / frame.width, (y - frame.top) / frame.height];
    }
    drawing = { photo, box, start, end: null };
  });
  document.addEventListener('pointermove', (event) => {
    if (!drawing) return;
    drawing.end = at(drawing.photo, event);
    const [x, y] = [0, 1].map((i) => [drawing.start[i], drawing.end[i]].sort((a, b) => a - b));
    drawing.range = [x[0], y[0], x[1], y[1]];
    const style = drawing.box.style;
    style.left = 100 * x[0] + '%';
    style.top = 100 * y[0] + '%';
    style.right = 100 - 100 * x[1] + '%';
    style.bottom = 100 - 100 * y[1] + '%';
  });
  document.addEventListener('pointerup', () => {
    if (drawing && drawing.end) {
      const { width, height, field } = drawing.photo.dataset;
      const scale = [width, height, width, height];
      type(field, drawing.range.map((v, i) => Math.round(v * scale[i])).join(' '));
    }
    drawing = null;
  });
})();
