// The server's answers. Everything is asked of the page's own origin.

export class ApiError extends Error {}

async function answer(response) {
  if (response.ok) return response;
  let text = `${response.status} ${response.statusText}`;
  try {
    const problem = await response.json();
    text = problem.detail || problem.title || text;
  } catch {
    // not a problem document: the status has to do
  }
  throw new ApiError(text);
}

const get = async (url, options) => answer(await fetch(url, options));
const post = async (url, body) =>
  (await get(url, { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(body) })).json();

export class MapApi {
  constructor(id) {
    this.base = `/v1/maps/${encodeURIComponent(id)}`;
  }
  static async list() {
    return (await get('/v1/maps')).json();
  }
  async facts() {
    return (await get(this.base)).json();
  }
  // [{id, etag, bbox}]
  async tiles(level) {
    return (await (await get(`${this.base}/tiles?level=${level}`)).json()).tiles;
  }
  // ArrayBuffer, or null where the map has no data. The server has browsers ask whether what they keep is still true.
  async tile(id, layers, etag, signal) {
    const response = await get(`${this.base}/tiles/${id}?layers=${layers}`, { signal, cache: etag ? 'default' : 'no-cache' });
    return response.status === 204 ? null : response.arrayBuffer();
  }
  async height(x, y) {
    return (await get(`${this.base}/height?x=${x}&y=${y}&layers=slope,cost,step`)).json();
  }
  route(from, to) {
    return post(`${this.base}/route`, { from, to });
  }
  async profile(line, step_m) {
    return (await post(`${this.base}/profile`, { line, resample_distance: step_m })).profile;
  }
  check(path) {
    return post(`${this.base}/check`, { path });
  }
  events() {
    return new EventSource(`${this.base}/events`);
  }
}
