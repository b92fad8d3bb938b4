// One or two previews on one clock.
"use strict";

const DRIFT = 0.08; // seconds that a clip may be off before it is moved
const PREFIX = 2.5; // seconds that a model is shown

const player = { time: 0, playing: false, rate: 15, clips: [] };

function lasts() {
  const lengths = player.clips.map((video) => video.duration).filter(Number.isFinite);
  return lengths.length ? Math.max(...lengths) : 0;
}

function setClips(ids) {
  pause();
  player.clips = ids.map((id) => {
    const video = element("video", {
      src: `previews/${id}.mp4`, poster: `previews/${id}.png`, muted: true, playsInline: true,
      preload: "auto", ariaLabel: `preview of ${id}`,
    });
    video.addEventListener("loadedmetadata", () => { drawTrack(); place(video); });
    video.addEventListener("error", () => {
      video.replaceWith(element("p", { className: "hint", role: "alert" }, `previews/${id}.mp4 cannot be played`));
    });
    video.addEventListener("click", toggle);
    return video;
  });
  const shown = player.clips.map((video, k) => {
    const title = ids.length > 1 ? [element("figcaption", {}, ids[k])] : [];
    return element("figure", {}, video, ...title);
  });
  byName("clips").replaceChildren(...shown);
  byName("clips").classList.toggle("two", ids.length > 1);
}

function drawTrack() {
  const length = lasts();
  byName("scrub").max = String(length || 1);
  byName("shown").style.width = `${length ? Math.min(100, (100 * PREFIX) / length) : 0}%`;
  drawTime();
}

function drawTime() {
  byName("scrub").value = String(player.time);
  const said = `${player.time.toFixed(2)} s`;
  byName("scrub").setAttribute("aria-valuetext", said);
  byName("time").value = `${said}, frame ${Math.floor(player.time * player.rate + 1e-6)}`;
}

// The middle of a frame: browsers round its edges either way.
function place(video) {
  const last = Math.max(0, (video.duration || 0) - 0.5 / player.rate);
  video.currentTime = Math.min(player.time + 0.25 / player.rate, last);
}

function seek(time) {
  player.time = Math.min(Math.max(time, 0), Math.max(0, lasts() - 1 / player.rate));
  for (const video of player.clips) place(video);
  drawTime();
}

function step(frames) {
  pause();
  seek((Math.floor(player.time * player.rate + 1e-6) + frames) / player.rate);
  rememberTime();
}

function toggle() {
  if (player.playing) {
    pause();
    rememberTime();
  } else play();
}

function play() {
  player.playing = true;
  byName("play").textContent = "Pause";
  let before = performance.now();
  const tick = (now) => {
    if (!player.playing) return;
    const speed = Number(byName("speed").value);
    const ready = player.clips.every((video) => video.readyState >= HTMLMediaElement.HAVE_CURRENT_DATA);
    if (ready) player.time += (speed * (now - before)) / 1000;
    before = now;
    if (lasts() && player.time >= lasts()) player.time = 0;
    for (const video of player.clips) follow(video, speed);
    drawTime();
    requestAnimationFrame(tick);
  };
  requestAnimationFrame(tick);
}

// A clip that is shorter than the other waits at its end.
function follow(video, speed) {
  const over = player.time >= video.duration - 0.5 / player.rate;
  if (over) {
    if (!video.paused) video.pause();
    return;
  }
  video.playbackRate = speed;
  if (Math.abs(video.currentTime - player.time) > Math.max(DRIFT, DRIFT * speed)) video.currentTime = player.time;
  if (!video.paused) return;
  video.play().catch((error) => { if (error.name !== "AbortError") pause(); }); // it is aborted by another
}

function pause() {
  player.playing = false;
  byName("play").textContent = "Play";
  for (const video of player.clips) video.pause();
}

byName("play").addEventListener("click", toggle);
byName("scrub").addEventListener("input", (event) => {
  pause();
  seek(Number(event.target.value));
});
byName("scrub").addEventListener("change", () => rememberTime());
