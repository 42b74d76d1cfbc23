/* Threads that share pieces of work, each of which takes much longer than the lock. */

#include "thread_pool.h"

int crew_begin(Crew *crew)
{
    crew->helpers = crew->pieces = crew->next = crew->left = crew->dismissed = 0;
    if (pthread_mutex_init(&crew->lock, NULL) != 0) {
        return 1;
    }
    if (pthread_cond_init(&crew->begun, NULL) != 0) {
        pthread_mutex_destroy(&crew->lock);
        return 1;
    }
    if (pthread_cond_init(&crew->done, NULL) != 0) {
        pthread_cond_destroy(&crew->begun);
        pthread_mutex_destroy(&crew->lock);
        return 1;
    }
    return 0;
}

void crew_end(Crew *crew)
{
    pthread_cond_destroy(&crew->done);
    pthread_cond_destroy(&crew->begun);
    pthread_mutex_destroy(&crew->lock);
}

/* Take pieces until none is left; the lock is held but while a piece is worked on. */
static void work(Crew *crew)
{
    while (crew->next < crew->pieces) {
        const int k = crew->next++;
        pthread_mutex_unlock(&crew->lock);
        crew->piece(crew->data, k);
        pthread_mutex_lock(&crew->lock);
        if (--crew->left == 0) {
            pthread_cond_signal(&crew->done);
        }
    }
}

void crew_help(Crew *crew)
{
    pthread_mutex_lock(&crew->lock);
    while (!crew->dismissed) {
        work(crew);
        if (!crew->dismissed) {
            pthread_cond_wait(&crew->begun, &crew->lock);
        }
    }
    pthread_mutex_unlock(&crew->lock);
}

void crew_dismiss(Crew *crew)
{
    if (crew->helpers > 0) {
        pthread_mutex_lock(&crew->lock);
        crew->dismissed = 1;
        pthread_cond_broadcast(&crew->begun);
        pthread_mutex_unlock(&crew->lock);
    }
}

void crew_share(Crew *crew, int pieces, Piece piece, void *data)
{
    if (crew->helpers == 0) {
        for (int k = 0; k < pieces; k++) {
            piece(data, k);
        }
        return;
    }
    pthread_mutex_lock(&crew->lock);
    crew->piece = piece;
    crew->data = data;
    crew->next = 0;
    crew->pieces = crew->left = pieces;
    pthread_cond_broadcast(&crew->begun);
    work(crew);
    while (crew->left > 0) {
        pthread_cond_wait(&crew->done, &crew->lock);
    }
    pthread_mutex_unlock(&crew->lock);
}
